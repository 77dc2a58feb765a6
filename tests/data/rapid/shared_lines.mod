MODULE SharedLines VAR num a; PERS num b:=1;
  PROC p() a:=1; b:=2; ! two
    IF a=1 THEN b:=1; ELSEIF a=2 THEN b:=2; ELSE b:=3; ENDIF
    FOR i FROM 1 TO 3 STEP 1 DO x{i}:=i; ENDFOR WHILE TRUE DO EXIT; ENDWHILE
    TEST a CASE 1,2: b:=1; CASE 3: DEFAULT: b:=2; ENDTEST
    lbl: GOTO lbl;
    WaitTime\InPos,0.5;RETURN;
  ENDPROC
ENDMODULE
