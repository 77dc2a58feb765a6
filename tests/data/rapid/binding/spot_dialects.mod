MODULE m
  CONST robtarget wp31274_2:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget swp_012345_l:=[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget W_00049:=[[3,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p10:=[[4,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    SpotL wp31274_2,v100,gun1,sdAny,\QuickRelease,tGun\WObj:=wTable;
    SpotL swp_012345_l,v100,sdAny,gun1,tGun\WObj:=wTable;
    SpotJ W_00049,v100,gun1,sdAny,tGun\WObj:=wTable;
    SpotML p10,v100,\G1:=sd_wp432810\G2:=sdAny,tGun\WObj:=wTable;
    SpotL [[5,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,gun1,sd_wp432810,tGun\WObj:=wTable;
    ! SpotL p10,v100,gun1,sd_wp432810,tGun;
    MoveLG 5,p10,v100,tGun\WObj:=wTable;
    SetGO goProgram,1; !Punto 17
    MoveL [[6,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGun\WObj:=wTable;
    Soldar\AbrirTotal;
    MoveL p10,v100,z10,tGun\WObj:=wTable; !Punto 18
  ENDPROC
ENDMODULE
