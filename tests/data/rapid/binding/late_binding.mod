MODULE m
  CONST robtarget p1:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    %"rStyle"+NumToStr(n,0)%;
    %stName% p1,tGun;
  ENDPROC
  PROC rStyle1()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC rStyle2()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC rOther()
  ENDPROC
ENDMODULE
